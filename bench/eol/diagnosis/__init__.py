"""The part of a motor that is at fault, by its procedures' findings: for the record, the page, the label and the rework place."""
