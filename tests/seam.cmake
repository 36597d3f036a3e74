# SPDX-License-Identifier: BSD-3-Clause
# What test_seam loads: one side of the seam, compiled as the lanes of the Python package are, and
# once with an option that changes the standard library's layout.
set(seam_flags_baseline "")
set(seam_flags_avx2 -mavx2 -mfma)
set(seam_flags_avx512 -mavx512f -mavx512dq -mavx512vl -mavx512bw -mavx2 -mfma)
set(seam_flags_debug -D_GLIBCXX_DEBUG)
foreach(level baseline avx2 avx512 debug)
  add_library(seam_${level} MODULE seam/facts.cpp)
  if(NOT level STREQUAL "debug")
    target_sources(seam_${level} PRIVATE seam/module.cpp)
  endif()
  target_link_libraries(seam_${level} PRIVATE filippov::filippov)
  target_compile_definitions(seam_${level} PRIVATE FILIPPOV_NO_FORCED_INLINING)
  target_compile_options(seam_${level} PRIVATE ${seam_flags_${level}})
  set_target_properties(
    seam_${level} PROPERTIES PREFIX "" SUFFIX .so CXX_VISIBILITY_PRESET hidden
                             VISIBILITY_INLINES_HIDDEN ON)
  add_dependencies(test_seam seam_${level})
endforeach()
target_compile_definitions(test_seam
                           PRIVATE FILIPPOV_SEAM_FOLDER="${CMAKE_CURRENT_BINARY_DIR}")
target_link_libraries(test_seam PRIVATE ${CMAKE_DL_LIBS})
