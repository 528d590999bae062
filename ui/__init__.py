"""The sidebar: properties, panels, operators, presets. A shell over calls a script makes too."""
