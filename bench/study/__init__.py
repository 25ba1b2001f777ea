"""The expected uncertainty of a station for a type: virtual motors, measured on the station's twin and compared with their true
values.
"""
