# SPDX-License-Identifier: BSD-3-Clause
# What `cmake --install` lays down, so that another project can find_package(roslam) and link roslam::roslam.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(ROSLAM_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/roslam)

install(TARGETS roslam EXPORT roslamTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
  INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
# The cost functions stay inside: they would make users of the headers need Ceres.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/roslam DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING PATTERN "*.hpp" PATTERN "bundle_cost.hpp" EXCLUDE PATTERN "yaml_file.hpp" EXCLUDE)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/models DESTINATION ${CMAKE_INSTALL_DATADIR}/roslam
  FILES_MATCHING PATTERN "*.onnx" PATTERN "*.vocabulary" PATTERN "*.md")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/roslam)

install(EXPORT roslamTargets NAMESPACE roslam:: DESTINATION ${ROSLAM_PACKAGE_DIR})
set(ROSLAM_ONNX_RUNTIME_FOUND OFF)
if(TARGET onnxruntime::onnxruntime)
  set(ROSLAM_ONNX_RUNTIME_FOUND ON)
endif()
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/roslamConfig.cmake.in
  ${PROJECT_BINARY_DIR}/roslamConfig.cmake INSTALL_DESTINATION ${ROSLAM_PACKAGE_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/roslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_SOURCE_DIR}/cmake/onnx_runtime.cmake ${PROJECT_BINARY_DIR}/roslamConfig.cmake ${PROJECT_BINARY_DIR}/roslamConfigVersion.cmake
  DESTINATION ${ROSLAM_PACKAGE_DIR})
