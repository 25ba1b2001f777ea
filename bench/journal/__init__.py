"""The record of a run: journal, waveforms, results, and views of them."""
