"""Speed against accuracy: trade-offs, tuning, measured numbers and stress, over what they share.

A study is a scene to simulate in many ways; its runs are timed, and judged by a known answer, by
conservation or by a reference that is refined until it settles.
"""
