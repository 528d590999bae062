"""Data sets for computer vision: which views to render, and files that other software reads.

It knows poses, cameras and paths, and nothing of Blender.
"""
