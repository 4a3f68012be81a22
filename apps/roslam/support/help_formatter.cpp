// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/help_formatter.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

namespace roslam::app {

namespace {
constexpr std::size_t kIndent = 2;
constexpr std::size_t kHanging = 4;  // of the second line of a command or a name

// Breaks a text at its spaces, each line but the first indented by `rest`. A longer word is broken after a
// punctuation mark, such as in a list of choices.
std::string fill(const std::string& text, std::size_t width, std::size_t first, std::size_t rest) {
  std::string all;
  std::string line(first, ' ');
  bool is_empty = true;
  const auto end_line = [&] {
    all += line + "\n";
    line.assign(rest, ' ');
    is_empty = true;
  };
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!is_empty && line.size() + 1 + word.size() > width) end_line();
    while (line.size() + word.size() > width) {
      const std::size_t room = width - line.size();
      const std::size_t mark = word.find_last_of(",/|=:", room - 1);
      const std::size_t cut = mark == std::string::npos ? room : mark + 1;
      line += word.substr(0, cut);
      word.erase(0, cut);
      end_line();
    }
    if (!is_empty) line += ' ';
    line += word;
    is_empty = false;
  }
  return all + line + "\n";
}

// A name, and from a column on its description, on the next line if the name reaches into the column.
std::string entry(const std::string& name, const std::string& text, std::size_t column, std::size_t width) {
  std::string names = fill(name, width, kIndent, kIndent + kHanging);
  if (text.empty()) return names;
  std::string body = fill(text, width, column, column);
  if (names.size() > column) return names + body;
  names.pop_back();
  return body.replace(0, names.size(), names);
}

// Of the second column of a list: where most of its lines go on after two spaces or more; 0 if there is none.
std::size_t second_column(const std::vector<std::string>& lines) {
  std::map<std::size_t, int> votes;
  for (const auto& line : lines) {
    const std::size_t gap = line.find("  ", std::min(line.find_first_not_of(' '), line.size()));
    if (gap != std::string::npos) ++votes[line.find_first_not_of(' ', gap)];
  }
  const auto most = std::max_element(votes.begin(), votes.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == votes.end() ? 0 : most->first;
}

// Joins lines with those that continue them: commands after a backslash, entries of a list in its second
// column.
std::vector<std::string> joined(const std::vector<std::string>& lines, std::size_t column) {
  std::vector<std::string> result;
  for (const auto& line : lines) {
    const std::size_t indent = line.find_first_not_of(' ');
    const bool continues = !result.empty() && result.back().ends_with(" \\");
    if (continues) result.back().resize(result.back().size() - 2);
    if (continues || (!result.empty() && column > 0 && indent >= column)) {
      result.back() += " " + line.substr(indent);
    } else {
      result.push_back(line);
    }
  }
  return result;
}

// Consecutive indented lines: a list in two columns, or example commands.
std::string fill_indented(const std::vector<std::string>& lines, std::size_t width) {
  const std::size_t column = second_column(lines);
  const std::size_t narrow = std::min(column, width * 2 / 5);
  std::string all;
  for (const auto& line : joined(lines, column)) {
    const std::size_t indent = line.find_first_not_of(' ');
    const std::string text = line.substr(indent);
    if (column > 0 && line.size() > column && line[column - 1] == ' ' && line[column] != ' ') {
      all += entry(line.substr(0, column), line.substr(column), narrow, width);
    } else if (text.starts_with("roslam ")) {  // may be copied into a shell
      std::string command = fill(text, width - 2, indent, indent + kHanging);
      for (std::size_t end = command.find('\n'); end + 1 < command.size(); end = command.find('\n', end + 3))
        command.insert(end, " \\");
      all += command;
    } else {
      all += fill(text, width, indent, indent);
    }
  }
  return all;
}

// Whether the sentence goes on in the next line.
bool is_open(const std::string& line) { return !line.ends_with('.') && !line.ends_with(':'); }
}  // namespace

std::size_t terminal_width() {
  constexpr long kLeast = 40, kUsual = 80, kMost = 120;
  long width = 0;
  if (const char* columns = std::getenv("COLUMNS")) width = std::strtol(columns, nullptr, 10);
  winsize size{};
  if (width <= 0 && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0) width = size.ws_col;
  return static_cast<std::size_t>(width <= 0 ? kUsual : std::clamp(width, kLeast, kMost));
}

std::string HelpFormatter::make_description(const CLI::App* app) const {
  return fill(Formatter::make_description(app), width_, 0, 0);
}

std::string HelpFormatter::make_usage(const CLI::App* app, std::string name) const {
  return fill(Formatter::make_usage(app, std::move(name)), width_, 0, 2 * kHanging);
}

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  return entry(make_option_name(option, is_positional) + make_option_opts(option), make_option_desc(option),
               std::min<std::size_t>(column_width_, width_ * 3 / 8), width_);
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return entry(command->get_display_name(true), command->get_description(),
               std::min<std::size_t>(column_width_, width_ * 3 / 8), width_);
}

std::string HelpFormatter::make_footer(const CLI::App* app) const {
  std::istringstream lines(app->get_footer());
  std::string all, paragraph;
  std::vector<std::string> indented;
  const auto end_block = [&] {
    if (!paragraph.empty()) all += fill(paragraph, width_, 0, 0);
    if (!indented.empty()) all += fill_indented(indented, width_);
    paragraph.clear();
    indented.clear();
  };
  for (std::string line; std::getline(lines, line);) {
    const bool is_text = !line.empty() && line.front() != ' ';
    if (is_text ? !indented.empty() || !is_open(paragraph) : !paragraph.empty() || line.empty()) end_block();
    if (is_text) {
      paragraph += (paragraph.empty() ? "" : " ") + line;
    } else if (line.empty()) {
      all += "\n";
    } else {
      indented.push_back(line);
    }
  }
  end_block();
  return all;
}

}  // namespace roslam::app
