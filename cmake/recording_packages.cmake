# SPDX-License-Identifier: BSD-3-Clause
# Libraries that some recordings need. Defines roslam_recording::NAME for each of ROSLAM_RECORDING_PACKAGES that is
# found (LZ4 BZ2 ZSTD SQLITE3) and sets roslam_recording_missing to the Debian packages of the others. Also used by the
# package that is installed.
set(roslam_recording_LZ4 lz4frame.h lz4 liblz4-dev)
set(roslam_recording_BZ2 bzlib.h bz2 libbz2-dev)
set(roslam_recording_ZSTD zstd.h zstd libzstd-dev)
set(roslam_recording_SQLITE3 sqlite3.h sqlite3 libsqlite3-dev)
set(roslam_recording_missing "")
foreach(name ${ROSLAM_RECORDING_PACKAGES})
  list(GET roslam_recording_${name} 0 header)
  list(GET roslam_recording_${name} 1 library)
  list(GET roslam_recording_${name} 2 package)
  if(NOT TARGET roslam_recording::${name})
    find_path(ROSLAM_${name}_INCLUDE_DIR ${header})
    find_library(ROSLAM_${name}_LIBRARY ${library})
    mark_as_advanced(ROSLAM_${name}_INCLUDE_DIR ROSLAM_${name}_LIBRARY)
    if(ROSLAM_${name}_INCLUDE_DIR AND ROSLAM_${name}_LIBRARY)
      add_library(roslam_recording::${name} UNKNOWN IMPORTED)
      set_target_properties(roslam_recording::${name} PROPERTIES IMPORTED_LOCATION "${ROSLAM_${name}_LIBRARY}"
        INTERFACE_INCLUDE_DIRECTORIES "${ROSLAM_${name}_INCLUDE_DIR}")
    else()
      list(APPEND roslam_recording_missing ${package})
    endif()
  endif()
endforeach()
