# SPDX-License-Identifier: BSD-3-Clause
"""The network that paints what was behind a removed object."""
