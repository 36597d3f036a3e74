# SPDX-License-Identifier: BSD-3-Clause
# Runs PROGRAM in FOLDER and compares what it prints with the file EXPECTED, to the character but for
# white space at the ends of lines.
#
#   cmake -DPROGRAM=... -DFOLDER=... -DEXPECTED=... -P compare_output.cmake

file(MAKE_DIRECTORY ${FOLDER})
execute_process(COMMAND ${PROGRAM} WORKING_DIRECTORY ${FOLDER} RESULT_VARIABLE status
                OUTPUT_VARIABLE actual ERROR_VARIABLE errors)
get_filename_component(name ${PROGRAM} NAME_WE)
set(actual_file ${FOLDER}/${name}.txt)
file(WRITE ${actual_file} "${actual}")
if(NOT status EQUAL 0)
  message(NOTICE "${actual}\n${errors}")
  message(FATAL_ERROR "${name} ended with ${status}")
endif()

file(READ ${EXPECTED} expected)
foreach(text IN ITEMS actual expected)
  string(REGEX REPLACE "[ \t\r]+\n" "\n" ${text} "${${text}}")
  string(STRIP "${${text}}" ${text})
endforeach()
if(NOT actual STREQUAL expected)
  find_program(DIFF diff)
  if(DIFF)
    execute_process(COMMAND ${DIFF} -u ${EXPECTED} ${actual_file} OUTPUT_VARIABLE difference)
  endif()
  message(NOTICE "${difference}\nIf the new output is right: cp ${actual_file} ${EXPECTED}")
  message(FATAL_ERROR "the output of ${name} is not the stored one")
endif()
