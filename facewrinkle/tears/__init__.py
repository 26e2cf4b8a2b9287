"""Tears that drip (`drop`) and tears that flow down the skin (`stream`), after Lin and Cheng, Section 4."""
