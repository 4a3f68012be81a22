// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/common/resources.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

namespace roslam {

namespace {
namespace fs = std::filesystem;

// The folder of the shared library or program that holds this function.
fs::path own_folder() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<void*>(&own_folder), &info) == 0 || info.dli_fname == nullptr) return {};
  std::error_code error;
  // A program may be named as it was called, relative to a working directory that has changed since.
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path named = fs::canonical(info.dli_fname, error);
  const bool is_program = error || named.filename() == program.filename();
  return (is_program && !program.empty() ? program : named).parent_path();
}

std::vector<fs::path> model_folders() {
  std::vector<fs::path> folders;
  if (const char* path = std::getenv("ROSLAM_MODEL_PATH")) {
    std::istringstream list(path);
    for (std::string folder; std::getline(list, folder, ':');)
      if (!folder.empty()) folders.emplace_back(folder);
  }
  // In the build tree, beside a program, in <prefix>/lib or <prefix>/lib/<architecture>.
  const fs::path own = own_folder();
  for (const char* relative : {"models", "../models", "../../models", "../../../models",
                               "../share/roslam/models", "../../share/roslam/models"})
    if (!own.empty()) folders.push_back(own / relative);
  folders.emplace_back(ROSLAM_INSTALLED_MODELS);
  return folders;
}
}  // namespace

fs::path find_resource(std::string_view name) {
  std::error_code error;
  for (const fs::path& folder : model_folders()) {
    const fs::path file = folder / name;
    if (fs::is_regular_file(file, error)) return file.lexically_normal();
  }
  return {};
}

}  // namespace roslam
