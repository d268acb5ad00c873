# SPDX-License-Identifier: Apache-2.0
# cmake -DSOURCE=FOLDER -DHEADER=FILE -P commit.cmake: writes the commit of a source tree to a header, if it differs from the one there.
cmake_minimum_required(VERSION 3.25)
find_program(git git)
set(commit "")
if(git)
  execute_process(COMMAND ${git} -C ${SOURCE} describe --always --dirty=+ --abbrev=12 --exclude=* OUTPUT_VARIABLE commit ERROR_QUIET
                  OUTPUT_STRIP_TRAILING_WHITESPACE)
endif()
if(commit STREQUAL "")
  set(commit "unknown")
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#pragma once\n#define TANDEM_COMMIT \"@commit@\"\n" @ONLY)
