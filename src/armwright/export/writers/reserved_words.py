"""Words that no program is called, in lower case: those of a language, what it predefines, and names of devices.

Controllers run Windows, on which no file is called like a device.
"""

_DEVICES = "aux com1 com2 com3 com4 con lpt1 lpt2 lpt3 nul prn"

_URSCRIPT = """
acos and asin atan atan2 break ceil continue cos def elif else end enum exp false floor force get_inverse_kin
get_standard_digital_in get_standard_digital_out get_steptime global halt if in join kill length local log mod movec
movej movel movep norm not or p pass point_dist popup pose_inv pose_trans pow random return rpy2rotvec run servoj
set_standard_digital_out set_tcp sin sleep sqrt stopj stopl str_cat sync tan textmsg thread to_num to_str true while
xor
"""
_KRL = """
abs acos and anin anout asin atan2 axis b_and b_exor b_not b_or bas bool brake bwdstart c_dis c_ori c_ptp c_vel case
cast_from cast_to char circ circ_rel const continue cos ddecl decl def default defdat deffct delay digin digout
distance do e6axis e6pos else end enddat endfct endfold endfor endif endloop endswitch endwhile enum exit exor ext
extfct false fold for frame global goto halt if import int interrupt is lin lin_rel loop maximum minimum not on or
path pos prio ptp ptp_rel public pulse real repeat return sec signal sin slin spl spline sptp sqrt state_t strclear
struc switch swrite tan then to trigger true until wait when while
"""
_RAPID = """
abs acos alias and atan2 backward bool case confdata confj confl connect const cos default dinput distance div do
doutput else elseif endfor endfunc endif endmodule endproc endrecord endtest endtrap endwhile error exit false fine
for from func goto if inout load0 local main mod module moveabsj movec movej movel nostepin not noview num or
orientzyx pers pose poseinv posemult proc pulsedo raise readonly record retry return robtarget round setdo sin sqrt
step string sysmodule tan test then to tool0 tool_1 tooldata tpwrite trap true trynext undo v1000 v50 valtostr var
viewonly waittime waituntil while with wobj0 xor z1
"""
_FANUC = """
abort and call cnt div do else end endfor endif fine for if jmp lbl message mod off on or override pause pulse run
select then timeout timer to uframe utool wait
"""
URSCRIPT, KRL, RAPID, FANUC = (frozenset(f"{words} {_DEVICES}".split()) for words in (_URSCRIPT, _KRL, _RAPID, _FANUC))
