"""The fits of all sensors: parameters, uncertainty, and which parameters the data determine."""
