# SPDX-License-Identifier: BSD-3-Clause
# Each header compiles alone, and twice.
set(alone_files)
foreach(header IN LISTS FILIPPOV_HEADERS)
  file(RELATIVE_PATH header ${PROJECT_SOURCE_DIR}/include ${header})
  string(REGEX REPLACE "\\.hpp$" ".cpp" alone ${CMAKE_CURRENT_BINARY_DIR}/alone/${header})
  file(CONFIGURE OUTPUT ${alone} CONTENT "#include <@header@>\n#include <@header@>\n" @ONLY)
  list(APPEND alone_files ${alone})
endforeach()
# All of them together, in both orders: names of one do not hide those of another.
foreach(order IN ITEMS sorted reversed)
  set(all ${FILIPPOV_HEADERS})
  list(SORT all)
  if(order STREQUAL reversed)
    list(REVERSE all)
  endif()
  set(lines "")
  foreach(header IN LISTS all)
    file(RELATIVE_PATH header ${PROJECT_SOURCE_DIR}/include ${header})
    string(APPEND lines "#include <${header}>\n")
  endforeach()
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/alone/${order}.cpp CONTENT "@lines@" @ONLY)
  list(APPEND alone_files ${CMAKE_CURRENT_BINARY_DIR}/alone/${order}.cpp)
endforeach()
add_library(filippov_headers_alone OBJECT ${alone_files})
target_link_libraries(filippov_headers_alone PRIVATE filippov::filippov
                                                     $<TARGET_NAME_IF_EXISTS:filippov::gsl>)
target_compile_options(filippov_headers_alone
                       PRIVATE $<$<NOT:$<CXX_COMPILER_ID:MSVC>>:-O0 -g0 -fno-sanitize=all>)
