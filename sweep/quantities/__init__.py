"""What can be asked of a mechanism, as data: reductions of pose outputs, and how names of quantities are composed."""
