"""What drivers of several makers share."""
