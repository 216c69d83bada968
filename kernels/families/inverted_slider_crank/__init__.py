"""Inverted slider-crank: the crank pin slides along a slot of the rocker, which oscillates or turns (Whitworth)."""

from kernels.families.inverted_slider_crank.motion import Design as Design
from kernels.families.inverted_slider_crank.motion import poses as poses
