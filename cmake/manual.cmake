# cmake -DPROGRAM=FILE -DVERSION=V -DFOLDER=WHERE -P manual.cmake: the manual page NAME.1 and the bash
# completion of a program, both from what it prints on -help.
cmake_policy(VERSION 3.25)
execute_process(COMMAND ${PROGRAM} -help OUTPUT_VARIABLE said RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} -help ends with status ${status}")
endif()
get_filename_component(name ${PROGRAM} NAME)
# CMake takes these apart in lists.
string(REPLACE ";" "<semicolon>" said "${said}")
string(REPLACE "[" "<open>" said "${said}")
string(REPLACE "]" "<close>" said "${said}")
string(REPLACE "\n" ";" lines "${said}")

list(POP_FRONT lines synopsis)
list(POP_FRONT lines purpose)
set(entries "")
set(words "")
set(choices "")
foreach(line IN LISTS lines)
  # Two columns, or one space where the left one is long.
  if(NOT line MATCHES "^  (.*[^ ])  +([^ ].*)$")
    if(NOT line MATCHES "^  ([^ ]+ ?[^ ]*) (.*)$")
      continue()
    endif()
  endif()
  set(left "${CMAKE_MATCH_1}")
  set(text "${CMAKE_MATCH_2}")
  string(APPEND entries ".TP\n.B ${left}\n${text}\n")
  if(NOT left MATCHES "^(-[a-z_]+) ?(.*)$")
    continue()
  endif()
  set(option "${CMAKE_MATCH_1}")
  set(values "${CMAKE_MATCH_2}")
  string(APPEND words " ${option}")
  if(values MATCHES "[|]")
    string(REGEX REPLACE "^[A-Z][^|]*[|]" "" values "${values}")
    string(REPLACE "|" " " values "${values}")
    string(APPEND choices "    ${option}) words=\"${values}\" ;;\n")
  endif()
endforeach()

string(TOUPPER ${name} title)
set(page ".TH ${title} 1 \"\" \"Repose ${VERSION}\"
.SH NAME
${name} - ${purpose}
.SH SYNOPSIS
${synopsis}
.SH OPTIONS
${entries}.PP
Every option of PETSc works too: -tao_type, -ksp_type, -log_view, -options_file and others.
.SH EXIT STATUS
0 done, 1 bad input (one line says what to change), 2 not converged (what was reached is written), 3 internal error.
")
string(REPLACE "\\" "\\\\" page "${page}")
string(REPLACE "-" "\\-" page "${page}")
set(completion "_${name}() {
  local words=\"${words}\" typed=\${COMP_WORDS[COMP_CWORD]}
  case \${COMP_WORDS[COMP_CWORD-1]} in
${choices}    *) [[ \$typed == -* ]] || return ;;
  esac
  COMPREPLY=(\$(compgen -W \"\$words\" -- \"\$typed\"))
}
complete -o default -F _${name} ${name}
")
foreach(text page completion)
  string(REPLACE "<semicolon>" ";" ${text} "${${text}}")
  string(REPLACE "<open>" "[" ${text} "${${text}}")
  string(REPLACE "<close>" "]" ${text} "${${text}}")
endforeach()
file(WRITE ${FOLDER}/man1/${name}.1 "${page}")
file(WRITE ${FOLDER}/completions/${name} "${completion}")
