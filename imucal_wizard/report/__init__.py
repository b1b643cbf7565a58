"""Output: text, tables, JSON documents, the calibration file, exports."""
