# Man page and completion of the program that was built, as PROGRAM itself describes its commands:
#   cmake -DPROGRAM=... -DSOURCE=... -DVERSION=... -DPREFIX=... -P install_pages.cmake

cmake_minimum_required(VERSION 3.24)
execute_process(COMMAND "${PROGRAM}" --help OUTPUT_VARIABLE help COMMAND_ERROR_IS_FATAL ANY)

# Rows "  name    what it is" become paragraphs of the section whose heading stands before them. Not a
# list of CMake's, which semicolons and brackets would divide otherwise.
string(REPLACE "\\" "\\e" help "${help}")
string(REPLACE "-" "\\-" help "${help}")
set(section "")
while(NOT help STREQUAL "")
  string(FIND "${help}" "\n" end)
  string(SUBSTRING "${help}" 0 ${end} line)
  math(EXPR next "${end} + 1")
  string(SUBSTRING "${help}" ${next} -1 help)
  if(line MATCHES "^(Stages|Commands|Exit codes)")
    string(REPLACE " " "_" section "${CMAKE_MATCH_1}")
  elseif(section AND line MATCHES "^  ([^ ]+) +(.*)$")
    string(APPEND ${section} ".TP\n.B ${CMAKE_MATCH_1}\n${CMAKE_MATCH_2}\n")
  endif()
endwhile()

set(man "${PREFIX}/share/man/man1")
configure_file("${SOURCE}/docs/atelier.1.in" "${man}/atelier.1" @ONLY)
file(ARCHIVE_CREATE OUTPUT "${man}/atelier.1.gz" PATHS "${man}/atelier.1" FORMAT raw COMPRESSION GZip)
file(REMOVE "${man}/atelier.1")

# A build without the pipeline has no command `completion`.
if(Commands MATCHES "\n.B completion\n")
  set(completion "${PREFIX}/share/bash-completion/completions/atelier")
  execute_process(COMMAND "${PROGRAM}" completion bash OUTPUT_VARIABLE script COMMAND_ERROR_IS_FATAL ANY)
  file(WRITE "${completion}" "${script}")
endif()
message("-- Installing: ${man}/atelier.1.gz")
