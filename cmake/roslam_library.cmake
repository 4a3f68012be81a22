# SPDX-License-Identifier: BSD-3-Clause
# roslam_library(name SOURCES ... PUBLIC ... PRIVATE ...): a library that is installed. Its sources are compiled once into
#   <name>            static or shared as BUILD_SHARED_LIBS says; installed; shared, it exports ROSLAM_EXPORT alone
#   <name>_internal   always static: the program, tests and tools here link it, as they use classes that are not exported
# PUBLIC and PRIVATE name libraries; another roslam_library among them is given without its suffix.
function(roslam_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(${name}_objects OBJECT ${ARG_SOURCES})
  target_link_libraries(${name}_objects PRIVATE roslam_flags)
  add_library(${name} $<TARGET_OBJECTS:${name}_objects>)
  set(targets ${name}_objects ${name})
  if(BUILD_SHARED_LIBS)
    add_library(${name}_internal STATIC $<TARGET_OBJECTS:${name}_objects>)
    list(APPEND targets ${name}_internal)
  else()
    add_library(${name}_internal ALIAS ${name})
  endif()
  set_target_properties(${name} PROPERTIES VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  foreach(target ${targets})
    target_include_directories(${target} PUBLIC
      $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/generated>)
    target_include_directories(${target} SYSTEM PUBLIC $<BUILD_INTERFACE:${OpenCV_INCLUDE_DIRS}>)
    target_compile_features(${target} PUBLIC cxx_std_20)
    foreach(kind PUBLIC PRIVATE)
      foreach(library ${ARG_${kind}})
        if(TARGET ${library}_internal AND target STREQUAL ${name}_internal)
          set(library ${library}_internal)
        endif()
        target_link_libraries(${target} ${kind} ${library})
      endforeach()
    endforeach()
  endforeach()
  roslam_precompiled_from(${name}_objects roslam_precompiled)
endfunction()
