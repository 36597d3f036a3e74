# SPDX-License-Identifier: BSD-3-Clause
# Builds and runs the project in consumer/ against this library, in one of three WAYs: package (after
# an installation into FOLDER), subdirectory, fetch.

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output
                  ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(NOTICE "${output}")
    message(FATAL_ERROR "ended with ${status}: ${ARGN}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${FOLDER})
if(WAY STREQUAL "package")
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${FOLDER}/prefix --component cpp)
endif()
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/consumer -B ${FOLDER}/build -G ${GENERATOR}
    -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${FOLDER}/prefix ${EIGEN_OPTION}
    -DCONSUMER_GSL=${GSL} -DCONSUMER_WAY=${WAY} -DCONSUMER_VERSION=${VERSION} -DFILIPPOV_SOURCE=${SOURCE})
run(${CMAKE_COMMAND} --build ${FOLDER}/build --config Release)
find_program(CONSUMER consumer PATHS ${FOLDER}/build ${FOLDER}/build/Release NO_DEFAULT_PATH
             REQUIRED)
run(${CONSUMER})
if(NOT output STREQUAL "filippov ${VERSION}\n")
  message(FATAL_ERROR "the consumer printed '${output}', expected 'filippov ${VERSION}'")
endif()
