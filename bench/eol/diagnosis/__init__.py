"""Which part of a motor is at fault, from what its procedures found: for the record, the page, the label and the rework place."""
