! Written for this test, with the constructs of 0-robinson-1/abb-rapid-robotics, exercises/03_motion_patterns.
MODULE Pattern
  CONST speeddata vSlow := [150, 400, 5000, 1000]; ! tool point, orientation, external axes
  CONST robtarget pFirst := [[300,-200,610],[0.5,0.5,0.5,0.5],[0,-1,-1,0],[9E9,9E+09,9E9,9E9,9E9,9E9]];
  PROC Rows()
    VAR num i;
    MoveJ pHome, v500, z50, tool0;
    FOR i FROM 0 TO 4 STEP 2 DO
      MoveL Offs(pFirst, 0, i*20, 0), v200, z5, tool0\WObj:=wobj0;
      SetDO doTool, 1;
      WHILE i < 3 AND NOT (DInput(diReady) = 1) DO
        WaitTime 0.1;
      ENDWHILE
      TEST i
      CASE 0, 2: SetDO doTool, 0;
      DEFAULT: Stop;
      ENDTEST
    ENDFOR
    TPWrite "He said ""done""";
  ENDPROC
ENDMODULE
