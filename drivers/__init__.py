"""Boards, converters, sensors and amplifiers between the numbers of the loop and the quantities of the plant."""
