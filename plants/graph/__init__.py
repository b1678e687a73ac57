"""Machines as graphs: a description of bodies, joints, drives and sensors becomes matrices, links, places and words."""
