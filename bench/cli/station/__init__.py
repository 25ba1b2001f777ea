"""`motorbench station`: looking after the instruments of a station."""
