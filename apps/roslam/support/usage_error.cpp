// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/usage_error.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <utility>
#include <vector>

namespace roslam::app {

namespace {
// A name as it is compared, and as it is shown.
using Names = std::vector<std::pair<std::string, std::string>>;

// Without dashes and capitals: --realtime, --Real-Time and --real-time are alike.
std::string plain(const std::string& name) {
  std::string result;
  for (const char c : name) {
    if (c != '-' && c != '_') result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return result;
}

// Number of letters to insert, delete, replace or swap with their neighbour (optimal string alignment).
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> least(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        least[i][j] = i + j;
        continue;
      }
      least[i][j] = std::min(
          {least[i - 1][j] + 1, least[i][j - 1] + 1, least[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        least[i][j] = std::min(least[i][j], least[i - 2][j - 2] + 1);
    }
  }
  return least[a.size()][b.size()];
}

// "; did you mean 'run'?", or nothing where no name is similar.
std::string suggestion(const std::string& given, const Names& names) {
  const std::string word = plain(given);
  const std::string* best = nullptr;
  std::size_t fewest = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const auto& [name, shown] : names) {
    const std::string other = plain(name);
    std::size_t found = edits(word, other);
    // An abbreviation, or a longer name for the same thing: bench, --output.
    const bool is_part = word.starts_with(other) || other.starts_with(word);
    if (is_part && std::min(word.size(), other.size()) >= 3) found = std::min<std::size_t>(found, 1);
    if (found >= fewest) continue;
    fewest = found;
    best = &shown;
  }
  return best == nullptr ? "" : "; did you mean '" + *best + "'?";
}

Names commands_of(const CLI::App& app) {
  Names names, nested;
  for (const CLI::App* command : app.get_subcommands({})) {
    names.emplace_back(command->get_name(), command->get_name());
    for (const CLI::App* inner : command->get_subcommands({}))
      nested.emplace_back(inner->get_name(), command->get_name() + " " + inner->get_name());
  }
  names.insert(names.end(), nested.begin(), nested.end());
  return names;
}

Names options_of(const CLI::App& app) {
  Names names;
  for (const CLI::Option* option : app.get_options()) {
    for (const auto& name : option->get_lnames()) names.emplace_back(name, "--" + name);
  }
  return names;
}

// An argument that the parser had no use for.
std::string explain_unknown(const CLI::App& app, const std::string& argument) {
  if (argument.starts_with('-') && argument.size() > 1) {
    const std::string name = argument.substr(0, argument.find('='));
    return "unknown option '" + name + "'" + suggestion(name, options_of(app));
  }
  const Names commands = commands_of(app);
  if (commands.empty()) return "unexpected argument '" + argument + "'";
  return "unknown command '" + argument + "'" + suggestion(argument, commands);
}
}  // namespace

std::string explain(const CLI::App& program, const CLI::ParseError& error) {
  std::string called = program.get_name();
  std::string text = error.what();
  const CLI::App* app = &program;
  while (true) {
    if (const auto unknown = app->remaining(); !unknown.empty()) {
      text = explain_unknown(*app, unknown.front());
      if (text.ends_with('?')) return text;
      break;
    }
    const auto given = app->get_subcommands();
    if (given.empty()) break;
    app = given.front();
    called += " " + app->get_name();
  }
  return text + "; see " + called + " --help";
}

}  // namespace roslam::app
