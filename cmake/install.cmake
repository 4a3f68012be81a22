# SPDX-License-Identifier: BSD-3-Clause
# What `cmake --install` lays down: the program, the libraries, the public headers and the models, so that another project
# can find_package(roslam), or pkg-config roslam, and link roslam::roslam.
include(CMakePackageConfigHelpers)
include(${PROJECT_SOURCE_DIR}/cmake/public_headers.cmake)
set(ROSLAM_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/roslam)

install(TARGETS roslam roslam_sensors roslam_telemetry EXPORT roslamTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
  INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
foreach(header ${ROSLAM_PUBLIC_HEADERS})
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${PROJECT_SOURCE_DIR}/roslam/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/roslam/${folder})
endforeach()
foreach(header ${ROSLAM_PUBLIC_TELEMETRY_HEADERS})
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${PROJECT_SOURCE_DIR}/telemetry/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/telemetry/${folder})
endforeach()
install(FILES ${PROJECT_BINARY_DIR}/generated/roslam/version.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/roslam)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/models DESTINATION ${CMAKE_INSTALL_DATADIR}/roslam
  FILES_MATCHING PATTERN "*.onnx" PATTERN "*.vocabulary" PATTERN "*.md")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/roslam)

install(EXPORT roslamTargets NAMESPACE roslam:: DESTINATION ${ROSLAM_PACKAGE_DIR})
set(ROSLAM_ONNX_RUNTIME_FOUND OFF)
if(TARGET onnxruntime::onnxruntime)
  set(ROSLAM_ONNX_RUNTIME_FOUND ON)
endif()
set(ROSLAM_IS_STATIC ON)
if(BUILD_SHARED_LIBS)
  set(ROSLAM_IS_STATIC OFF)
endif()
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/roslamConfig.cmake.in
  ${PROJECT_BINARY_DIR}/roslamConfig.cmake INSTALL_DESTINATION ${ROSLAM_PACKAGE_DIR}
  PATH_VARS CMAKE_INSTALL_DATADIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/roslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_SOURCE_DIR}/cmake/onnx_runtime.cmake ${PROJECT_SOURCE_DIR}/cmake/recording_packages.cmake
  ${PROJECT_BINARY_DIR}/roslamConfig.cmake
  ${PROJECT_BINARY_DIR}/roslamConfigVersion.cmake DESTINATION ${ROSLAM_PACKAGE_DIR})

# pkg-config. The prefix is that of the file itself, wherever it was installed to.
file(RELATIVE_PATH ROSLAM_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
string(REGEX REPLACE "/$" "" ROSLAM_PC_PREFIX "${ROSLAM_PC_PREFIX}")
list(GET OpenCV_INCLUDE_DIRS 0 ROSLAM_PC_OPENCV_INCLUDE)
set(ROSLAM_PC_PRIVATE_LIBS "-lopencv_calib3d -lopencv_video -lceres -lglog -lyaml-cpp -lz -ldl")
if(ROSLAM_HAS_OPENCV_DNN)
  string(APPEND ROSLAM_PC_PRIVATE_LIBS " -lopencv_dnn")
endif()
if(ROSLAM_HAS_OPENCV_PHOTO)
  string(APPEND ROSLAM_PC_PRIVATE_LIBS " -lopencv_photo")
endif()
if(ROSLAM_HAS_DENSE)
  string(APPEND ROSLAM_PC_PRIVATE_LIBS " -loctomap -loctomath")
endif()
if(ROSLAM_ONNX_RUNTIME_FOUND)
  string(APPEND ROSLAM_PC_PRIVATE_LIBS " -lonnxruntime")
endif()
if(ROSLAM_HAS_REALSENSE)
  string(APPEND ROSLAM_PC_PRIVATE_LIBS " -lrealsense2")
endif()
foreach(name ${ROSLAM_HAS_RECORDING})
  list(GET roslam_recording_${name} 1 library)
  string(APPEND ROSLAM_PC_PRIVATE_LIBS " -l${library}")
endforeach()
string(APPEND ROSLAM_PC_PRIVATE_LIBS " -lopencv_imgcodecs -pthread")
if(ROSLAM_IS_STATIC)  # `pkg-config --libs` without --static has to give all that a static library needs
  set(ROSLAM_PC_LIBS " ${ROSLAM_PC_PRIVATE_LIBS}")
  set(ROSLAM_PC_PRIVATE_LIBS "")
endif()
configure_file(${PROJECT_SOURCE_DIR}/cmake/roslam.pc.in ${PROJECT_BINARY_DIR}/roslam.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/roslam.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
