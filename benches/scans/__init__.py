"""``ScanTTC`` and ``ittc``: the scans, the questions, and who answers them."""
