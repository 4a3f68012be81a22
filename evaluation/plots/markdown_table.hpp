// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace roslam::evaluation {

/// The cells of a table's row.
using TableRow = std::vector<std::string>;

/// A Markdown table that also reads well as plain text: the first column to the left, the others, which hold
/// numbers, to the right, all cells of a column of one width. The first row is the header; no row may have
/// more cells than it.
std::string markdown_table(const std::vector<TableRow>& rows);

/// A name escaped for a table cell.
std::string table_cell(std::string name);

/// A number with that many decimals; "-" if not finite.
std::string fixed(double value, int decimals);

/// A share as "12.3 %"; "-" if not finite.
std::string percentage(double share, int decimals = 1);

}  // namespace roslam::evaluation
