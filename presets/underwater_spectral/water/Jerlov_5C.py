"""Jerlov 5C."""

import bpy

water = bpy.context.scene.underwater

water.water = "jerlov:5C"
water.water_source = "solonenko2015"
water.concentration = 1.0
water.chlorophyll = 1.0
water.cdom = 0.05
water.minerals = 0.0
water.detritus = 0.0
water.second_water = ""
water.second_water_fraction = 0.0
water.absorption_factor = 1.0
water.scattering_factor = 1.0
water.phase = "mixture"
water.inelastic = ""
