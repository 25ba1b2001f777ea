"""One real instrument each, behind the interface of its kind."""
