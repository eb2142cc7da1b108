"""Words that no program is called, in lower case: those of a language, and functions that exported programs call."""

_URSCRIPT = """
and break continue def elif else end enum false force get_inverse_kin get_standard_digital_in get_standard_digital_out
get_steptime global halt if in join kill local mod movec movej movel movep not or p pass point_dist popup pose_inv
pose_trans return rpy2rotvec run servoj set_standard_digital_out set_tcp sleep stopj stopl str_cat sync textmsg thread
to_num to_str true while xor
"""
_KRL = """
and anin anout axis b_and b_exor b_not b_or bas bool brake bwdstart c_dis c_ori c_ptp c_vel case cast_from cast_to
char circ circ_rel const continue ddecl decl def default defdat deffct delay digin digout distance do e6axis e6pos
else end enddat endfct endfold endfor endif endloop endswitch endwhile enum exit exor ext extfct false fold for frame
global goto halt if import int interrupt is lin lin_rel loop maximum minimum not on or path pos prio ptp ptp_rel
public pulse real repeat return sec signal slin spl spline sptp state_t strclear struc switch swrite then to trigger
true until wait when while
"""
_RAPID = """
alias and backward bool case confdata confj confl connect const default dinput distance div do doutput else elseif
endfor endfunc endif endmodule endproc endrecord endtest endtrap endwhile error exit false for from func goto if inout
load0 local main mod module moveabsj movec movej movel nostepin not noview num or orientzyx pers pose poseinv posemult
proc pulsedo raise readonly record retry return robtarget setdo step string sysmodule test then to tool0 tool_1
tpwrite trap true trynext undo valtostr var viewonly waittime waituntil while with wobj0 xor
"""
_FANUC = """
abort and call cnt do div else end endfor endif fine for if jmp lbl message mod off on or override pause pulse run
select then timeout timer to uframe utool wait
"""
# What one of the languages predefines, and names of devices, which Windows gives to no file: controllers run it.
_PREDEFINED = """
abs acos asin atan atan2 aux ceil com1 com2 com3 com4 con cos exp fine floor length log lpt1 lpt2 lpt3 norm nul pow prn
random round sin sqrt tan tooldata v1000 v50 z1
"""
URSCRIPT, KRL, RAPID, FANUC = (
    frozenset(f"{words}{_PREDEFINED}".split()) for words in (_URSCRIPT, _KRL, _RAPID, _FANUC)
)
