// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/plots/markdown_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace roslam::evaluation {

std::string fixed(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

std::string table_cell(std::string name) {
  for (auto at = name.find('|'); at != std::string::npos; at = name.find('|', at + 2))
    name.insert(at, 1, '\\');
  return name;
}

std::string markdown_table(const std::vector<TableRow>& rows) {
  std::vector<std::size_t> widths(rows.front().size(), 3);
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    text += "|";
    for (std::size_t c = 0; c < rows[r].size(); ++c) {
      const std::string padding(widths[c] - rows[r][c].size(), ' ');
      text += " ";
      text += c == 0 ? rows[r][c] + padding : padding + rows[r][c];
      text += " |";
    }
    text += "\n";
    if (r > 0) continue;
    text += "|";
    for (std::size_t c = 0; c < widths.size(); ++c) {
      text += std::string(widths[c] + 1, '-');
      text += c == 0 ? "-|" : ":|";
    }
    text += "\n";
  }
  return text;
}

std::string percentage(double share, int decimals) {
  const std::string value = fixed(100.0 * share, decimals);
  return value == "-" ? value : value + " %";
}

}  // namespace roslam::evaluation
