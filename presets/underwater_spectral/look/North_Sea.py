"""Coastal water of the North Sea, a dark floor at 25 m, a low sun."""

import bpy

water = bpy.context.scene.underwater

water.water = "jerlov:3C"
water.water_source = "solonenko2015"
water.concentration = 1.0
water.chlorophyll = 1.0
water.cdom = 0.05
water.minerals = 0.0
water.detritus = 0.0
water.second_water = ""
water.second_water_share = 0.0
water.absorption_factor = 1.0
water.scattering_factor = 1.0
water.phase = "mixture"
water.inelastic = ""
water.floor_depth = 25.0
water.floor_reflectance = "0.1"
water.scene_floor = True
water.surface = "flat"
water.mirrored_things = False
water.wind_speed = 5.0
water.wind_direction = 0.0
water.fetch = 500.0
water.caustics = 1.0
water.wave_time_scale = 1.0
water.wave_loop = 0.0
water.wave_seed = 0
water.wave_tile = 10.0
water.wave_resolution = 512
water.snow = 0.0
water.snow_of_water = 0.0
water.plankton = 0.0
water.bubbles = 0.0
water.silt = 0.0
water.drift_speed = 0.02
water.drift_direction = 0.0
water.particle_seed = 0
water.particle_slope = 3.6
water.particle_angle = 0.3
water.illuminant = "clear-sky"
water.sun_zenith = 50.0
water.sun_azimuth = 0.0
water.sky = "uniform"
water.sky_radiance = 0.0
water.irradiance = "above"
water.refractive_index = 1.34
water.sunlight = 1.0
water.white_balance = "daylight"
water.exposure = "auto-picture"
water.exposure_compensation = 0.0
water.tone = "nikon-d7000"
water.contrast = "medium"
