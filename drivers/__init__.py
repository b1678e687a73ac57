"""Boards, converters, sensors and amplifiers: what stands between a number in the loop and a quantity in the plant."""
