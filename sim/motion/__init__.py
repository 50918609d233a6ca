"""Motion clips of AMASS form."""
