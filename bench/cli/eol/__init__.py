"""`motorbench eol`: batches of motors, their plans, records and statistics."""
