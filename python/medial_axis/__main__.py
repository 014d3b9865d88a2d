"""`python -m medial_axis` is the command `medial`."""

from ._command import main

main()
