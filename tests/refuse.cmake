# SPDX-License-Identifier: BSD-3-Clause
# Compiles SOURCE and demands that it fails, and that its first error has the text named in its first
# line:
#
#   // expect: a part of the compiler's message
#
# and, if it is to be compiled with more options, `// options: -one -two` in its second.

file(READ ${SOURCE} text)
if(NOT text MATCHES "^// expect: ([^\n]+)\n")
  message(FATAL_ERROR "${SOURCE}: first line must be '// expect: <part of the message>'")
endif()
string(STRIP "${CMAKE_MATCH_1}" expected)

file(STRINGS ${INCLUDE_FOLDERS} folders)
list(TRANSFORM folders PREPEND -I)
# The source line is not echoed: it could contain the expected text.
if(COMPILER_ID STREQUAL "MSVC")
  set(options /std:c++20 /EHsc /Zs)
elseif(COMPILER_ID STREQUAL "GNU")
  set(options -std=c++20 -fsyntax-only -fno-diagnostics-show-caret)
else()
  set(options -std=c++20 -fsyntax-only -fno-caret-diagnostics)
endif()
if(text MATCHES "^[^\n]+\n// options: ([^\n]+)\n")
  separate_arguments(more UNIX_COMMAND "${CMAKE_MATCH_1}")
  list(APPEND options ${more})
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -E env LC_ALL=C ${COMPILER} ${options} ${folders} ${SOURCE}
                RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(status EQUAL 0)
  message(FATAL_ERROR "compiles, and must not: ${SOURCE}")
endif()
string(FIND "${output}" "${expected}" position)
if(position EQUAL -1)
  message(NOTICE "expected: ${expected}\n${output}")
  message(FATAL_ERROR "refused for another reason: ${SOURCE}")
endif()
# Before it come places alone: from where it was included and instantiated.
string(REGEX MATCH "[^\n]*error(: | C[0-9])[^\n]*" first "${output}")
string(FIND "${first}" "${expected}" position)
if(position EQUAL -1)
  message(NOTICE "expected: ${expected}\n${output}")
  message(FATAL_ERROR "the first error is another: ${SOURCE}")
endif()
