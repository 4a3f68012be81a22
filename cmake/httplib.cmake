# SPDX-License-Identifier: BSD-3-Clause
# The target roslam_httplib, if cpp-httplib is installed in a version that telemetry/view/http_server.cpp can use: compiled
# (Debian) or a header alone (Ubuntu).
find_path(ROSLAM_HTTPLIB_INCLUDE httplib.h)
find_library(ROSLAM_HTTPLIB_LIBRARY cpp-httplib)
mark_as_advanced(ROSLAM_HTTPLIB_INCLUDE ROSLAM_HTTPLIB_LIBRARY)
set(ROSLAM_HTTPLIB_FOUND OFF)
if(ROSLAM_HTTPLIB_INCLUDE)
  add_library(roslam_httplib INTERFACE)
  target_include_directories(roslam_httplib SYSTEM INTERFACE ${ROSLAM_HTTPLIB_INCLUDE})
  target_link_libraries(roslam_httplib INTERFACE Threads::Threads)
  if(ROSLAM_HTTPLIB_LIBRARY)  # its classes have the members that these macros give them
    target_link_libraries(roslam_httplib INTERFACE ${ROSLAM_HTTPLIB_LIBRARY})
    target_compile_definitions(roslam_httplib INTERFACE CPPHTTPLIB_OPENSSL_SUPPORT CPPHTTPLIB_ZLIB_SUPPORT
      CPPHTTPLIB_BROTLI_SUPPORT)
  endif()
  if(NOT DEFINED ROSLAM_HTTPLIB_FITS)
    set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
    try_compile(ROSLAM_HTTPLIB_FITS ${PROJECT_BINARY_DIR}/httplib_check
      ${PROJECT_SOURCE_DIR}/telemetry/view/http_server.cpp
      CMAKE_FLAGS "-DINCLUDE_DIRECTORIES=${PROJECT_SOURCE_DIR};${ROSLAM_HTTPLIB_INCLUDE}"
      CXX_STANDARD 20 CXX_STANDARD_REQUIRED ON OUTPUT_VARIABLE output)
    unset(CMAKE_TRY_COMPILE_TARGET_TYPE)
    if(NOT ROSLAM_HTTPLIB_FITS)
      message(STATUS "cpp-httplib in ${ROSLAM_HTTPLIB_INCLUDE} does not fit: versions 0.10 to 0.18 do")
    endif()
  endif()
  set(ROSLAM_HTTPLIB_FOUND ${ROSLAM_HTTPLIB_FITS})
endif()
