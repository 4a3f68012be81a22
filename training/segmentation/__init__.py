# SPDX-License-Identifier: BSD-3-Clause
"""Training of the network that labels every pixel; see training/README.md."""
