// SPDX-License-Identifier: BSD-3-Clause
// Shared objects that link libroslam, statically and as a shared library, are loaded at run time and used.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <string>

namespace {

class Plugin : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    handle_ = dlopen(GetParam(), RTLD_NOW | RTLD_LOCAL);
    ASSERT_NE(handle_, nullptr) << dlerror();
  }
  void TearDown() override {
    if (handle_ != nullptr) dlclose(handle_);
  }

  template <typename Function>
  Function find(const char* name) const {
    return reinterpret_cast<Function>(dlsym(handle_, name));
  }

  void* handle_ = nullptr;
};

TEST_P(Plugin, TracksFrames) {
  const auto track = find<int (*)()>("plugin_track");
  ASSERT_NE(track, nullptr);
  EXPECT_EQ(track(), 3);
}

TEST_P(Plugin, CatchesExceptionsByType) {
  const auto catches = find<int (*)()>("plugin_catches");
  ASSERT_NE(catches, nullptr);
  EXPECT_EQ(catches(), 1);
}

TEST_P(Plugin, KnowsTheVersion) {
  const auto version = find<const char* (*)()>("plugin_version");
  ASSERT_NE(version, nullptr);
  EXPECT_STREQ(version(), ROSLAM_TEST_VERSION);
}

INSTANTIATE_TEST_SUITE_P(Linked, Plugin,
                         testing::Values(ROSLAM_TEST_PLUGIN_STATIC, ROSLAM_TEST_PLUGIN_SHARED),
                         [](const auto& parameter) {
                           return parameter.index == 0 ? "statically" : "dynamically";
                         });

// Nothing but what the public headers declare is exported: internal classes can change without breaking
// users.
TEST(SharedLibrary, ExportsPublicFunctionsOnly) {
  void* library = dlopen(ROSLAM_TEST_SHARED, RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(library, nullptr) << dlerror();
  EXPECT_NE(dlsym(library, "_ZN6roslam4Slam6finishEv"), nullptr);            // Slam::finish
  EXPECT_EQ(dlsym(library, "_ZN6roslam14KeyframeWorker5drainEv"), nullptr);  // an internal class
  dlclose(library);
}

}  // namespace
