"""Jobs for render farms: a folder that a farm takes, in Open Job Description."""
