# tandem_process_test(NAME FILE file.py [CASE class] LABEL label TIMEOUT seconds [REALTIME]): a Python program that controls the executables
# of this build. REALTIME: it runs alone, because its processes have deadlines.
include_guard(DIRECTORY)
include(${PROJECT_SOURCE_DIR}/tests/needs.cmake)
find_package(Python3 REQUIRED COMPONENTS Interpreter)

function(tandem_process_test name)
  cmake_parse_arguments(arg "REALTIME" "FILE;CASE;LABEL;TIMEOUT" "" ${ARGN})
  add_test(NAME ${name} COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/${arg_FILE}
           ${CMAKE_RUNTIME_OUTPUT_DIRECTORY} ${arg_CASE})
  set_tests_properties(${name} PROPERTIES LABELS ${arg_LABEL} TIMEOUT ${arg_TIMEOUT}
                       ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
  tandem_needs(python:yaml=python3-yaml TESTS ${name})
  if(arg_REALTIME)
    set_tests_properties(${name} PROPERTIES RUN_SERIAL ON)
  endif()
endfunction()
