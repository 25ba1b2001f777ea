"""Parts of simulated oscilloscopes: acquisition, records, edges, channels, trigger, screen measurements."""
