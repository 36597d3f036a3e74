# SPDX-License-Identifier: BSD-3-Clause
# Each header compiles alone, and twice.
set(alone_files)
foreach(header IN LISTS FILIPPOV_HEADERS)
  file(RELATIVE_PATH header ${PROJECT_SOURCE_DIR}/include ${header})
  string(REGEX REPLACE "\\.hpp$" ".cpp" alone ${CMAKE_CURRENT_BINARY_DIR}/alone/${header})
  file(CONFIGURE OUTPUT ${alone} CONTENT "#include <@header@>\n#include <@header@>\n" @ONLY)
  list(APPEND alone_files ${alone})
endforeach()
add_library(filippov_headers_alone OBJECT ${alone_files})
target_link_libraries(filippov_headers_alone PRIVATE filippov::filippov
                                                     $<TARGET_NAME_IF_EXISTS:filippov::gsl>)
target_compile_options(filippov_headers_alone
                       PRIVATE $<$<NOT:$<CXX_COMPILER_ID:MSVC>>:-O0 -g0 -fno-sanitize=all>)
