"""``SweptPath`` and ``ScanSweptPath``: what the car of the scans would run into."""
