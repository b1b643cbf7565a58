"""Files of other kinds, known by their first bytes: what they are, and how to get text out of them.

Sources: the formats' own specifications and the descriptions of the devices' protocols.
"""

_AS_TEXT = "switch the device to text (ASCII) output, or export the log as CSV with its own program"

_MAGIC: tuple[tuple[bytes, str, str], ...] = (
    (
        b"PK\x03\x04",
        "a ZIP archive, an Excel sheet or a NumPy .npz",
        "unpack it, or save it as CSV",
    ),
    (b"\x93NUMPY", "a NumPy array", "write it as text with numpy.savetxt and a header of names"),
    (b"MATLAB 5.0", "a MATLAB file", "write it as text with writetable or writematrix"),
    (b"\x89HDF", "an HDF5 or MATLAB 7.3 file", "export its arrays as CSV"),
    (b"BZh91AY", "compressed by bzip2", "unpack it with bunzip2"),
    (b"\xfd7zXZ", "compressed by xz", "unpack it with unxz"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it"),
    (b"\x28\xb5\x2f\xfd", "compressed by zstd", "unpack it with unzstd"),
    (b"\xd0\xcf\x11\xe0", "an old Excel sheet", "save it as CSV"),
    (b"PAR1\x15", "a Parquet file", "export it as CSV"),
    (b"#ROSBAG", "a ROS bag", "export the topic with rostopic echo -b FILE -p TOPIC"),
    (b"\x89MCAP", "an MCAP file of ROS 2", "export the topic as CSV"),
    (b"ULog\x01", "a PX4 log", "export it with ulog2csv and give the sensor_combined file"),
    (b"\xa3\x95", "an ArduPilot log", "export it with mavlogdump.py --format csv --types IMU"),
    (b"H Product:Blackbox", "a Betaflight log", "export it with blackbox_decode"),
    (b"\xfa\xff", "a capture of the Xsens protocol", _AS_TEXT),
    (b"\xff\x5a", "a capture of the SBG protocol", _AS_TEXT),
    (b"\x89PNG", "a picture", "give the recording instead"),
    (b"%PDF", "a PDF", "give the recording instead"),
)


def foreign(data: bytes) -> str:
    """What a file that is no text is, and what to do with it, in words; ``""`` when not known."""
    for magic, what, remedy in _MAGIC:
        if data.startswith(magic):
            return f"it is {what}; {remedy}"
    return ""
