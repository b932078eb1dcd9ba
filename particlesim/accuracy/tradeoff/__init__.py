"""Speed against accuracy, measured: what each knob costs, and what it buys."""
