# SPDX-License-Identifier: BSD-3-Clause
# Checks of the house: floors, what must be refused, and how others use the library.

# Floors.
find_package(Python3 QUIET COMPONENTS Interpreter)
if(Python3_Interpreter_FOUND)
  add_test(NAME floors COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/scripts/check_floors.py)
  set_tests_properties(floors PROPERTIES TIMEOUT 60)
endif()

# Each file of refuse/ must fail to compile, with the text of its first line.
file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/include_folders.txt
     CONTENT "$<JOIN:$<TARGET_PROPERTY:filippov_test_main,INCLUDE_DIRECTORIES>,\n>\n")
function(filippov_refuse name file)
  add_test(NAME refuse.${name}
           COMMAND ${CMAKE_COMMAND} -DSOURCE=${file} -DCOMPILER=${CMAKE_CXX_COMPILER}
                   -DCOMPILER_ID=${CMAKE_CXX_COMPILER_ID}
                   -DINCLUDE_FOLDERS=${CMAKE_CURRENT_BINARY_DIR}/include_folders.txt
                   -P ${CMAKE_CURRENT_LIST_DIR}/refuse.cmake)
  set_tests_properties(refuse.${name} PROPERTIES TIMEOUT 120 LABELS refuse ${ARGN})
endfunction()
file(GLOB refuse_files CONFIGURE_DEPENDS refuse/*.cpp)
if(MSVC) # its option is another
  list(FILTER refuse_files EXCLUDE REGEX no_exceptions)
endif()
foreach(file IN LISTS refuse_files)
  get_filename_component(name ${file} NAME_WE)
  filippov_refuse(${name} ${file})
endforeach()
# The harness itself: a program that compiles, and one refused for another reason, or for another one
# first, do not pass.
file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/refuse/valid.cpp
     CONTENT "// expect: anything\n#include <filippov/version.hpp>\nint main() {}\n")
file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/refuse/other_reason.cpp
     CONTENT "// expect: a text that no compiler says\nint main() { return undeclared_name; }\n")
file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/refuse/later_error.cpp
     CONTENT "// expect: the reason\nint n = undeclared_name;\nstatic_assert(false, \"the reason\");\n")
filippov_refuse(_rejects_a_valid_program ${CMAKE_CURRENT_BINARY_DIR}/refuse/valid.cpp
                PASS_REGULAR_EXPRESSION "compiles, and must not")
filippov_refuse(_rejects_another_reason ${CMAKE_CURRENT_BINARY_DIR}/refuse/other_reason.cpp
                PASS_REGULAR_EXPRESSION "refused for another reason")
filippov_refuse(_rejects_a_later_error ${CMAKE_CURRENT_BINARY_DIR}/refuse/later_error.cpp
                PASS_REGULAR_EXPRESSION "the first error is another")

# A project of somebody else's uses the library: installed, as a subfolder, and fetched.
set(consumer_ways subdirectory fetch)
if(Eigen3_DIR)
  list(APPEND consumer_ways package)
  set(consumer_eigen -DEIGEN_OPTION=-DEigen3_DIR=${Eigen3_DIR})
else()
  set(consumer_eigen -DEIGEN_OPTION=-DFETCHCONTENT_SOURCE_DIR_EIGEN3=${eigen3_SOURCE_DIR})
endif()
if(TARGET filippov::gsl)
  set(consumer_gsl -DGSL=ON)
endif()
foreach(way IN LISTS consumer_ways)
  add_test(NAME consumer.${way}
           COMMAND ${CMAKE_COMMAND} -DWAY=${way} -DSOURCE=${PROJECT_SOURCE_DIR}
                   -DBUILD=${PROJECT_BINARY_DIR} -DVERSION=${FILIPPOV_VERSION}
                   -DGENERATOR=${CMAKE_GENERATOR} -DCOMPILER=${CMAKE_CXX_COMPILER}
                   -DFOLDER=${CMAKE_CURRENT_BINARY_DIR}/consumer/${way} ${consumer_eigen}
                   ${consumer_gsl}
                   -P ${CMAKE_CURRENT_LIST_DIR}/consumer.cmake)
  set_tests_properties(consumer.${way} PROPERTIES TIMEOUT 300 LABELS consumer)
endforeach()
