/PROG  PICK_9	  Macro
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "Own program";
PROG_SIZE	= 1822;
CREATE		= DATE 24-01-02  TIME 03:04:05;
MODIFIED	= DATE 24-01-02  TIME 03:04:05;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 34;
MEMORY_SIZE	= 2070;
PROTECT		= READ_WRITE;
TCD:  STACK_SIZE	= 0,
      TASK_PRIORITY	= 50,
      TIME_SLICE	= 0,
      BUSY_LAMP_OFF	= 0,
      ABORT_REQUEST	= 0,
      PAUSE_REQUEST	= 0;
DEFAULT_GROUP	= 1,1,*,*,*;
CONTROL_CODE	= 00000000 00000000;
LOCAL_REGISTERS	= 0,0,0;
/APPL
  AUTO_SINGULARITY_HEADER;
  ENABLE_SINGULARITY_AVOIDANCE   : TRUE;
/MN
   1:  !Own program with constructs of ;
   2:  !public ones (JuniorNatalin/VASC, ;
   3:  !GilbertPan97/SnapMaster and ;
   4:  !ros-industrial/fanuc) ;
   5:   ;
   6:  OVERRIDE=20% ;
   7:  UFRAME_NUM=0 ;
   8:  UTOOL_NUM=2 ;
   9:  PAYLOAD[2] ;
  10:J P[1] 100% CNT0 ACC100 TB    .10sec,P-SPS    ;
  11:  LBL[1:again] ;
  12:  R[22:parts]=R[22:parts]+1    ;
  13:  PR[99,3:place]=(PR[99,3:place]+(R[22:parts]*R[34:height])) ;
  14:  IF (R[22:parts]>=4 AND !DI[61]),JMP LBL[2] ;
  15:  DO[23]=(OFF) ;
  16:  TIMER[4]=RESET ;
  17:  WAIT (DI[23] OR DI[24:vacuum])    ;
  18:  WAIT DI[5]=ON TIMEOUT,LBL[2] ;
  19:  WAIT    .30(sec) ;
  20:L P[2:"above"] 100mm/sec CNT100    ;
  21:L PR[99] R[26:feed]mm/sec FINE Offset,PR[5]    ;
  22:C P[3]    
    :  P[4] 50cm/min FINE    ;
  23:  DO[80:grip]=PULSE,0.5sec ;
  24:  CALL GRIPPER(3,R[1])    ;
  25:  IF (R[22:parts]=2) THEN ;
  26:  MESSAGE[half of them] ;
  27:  ELSE ;
  28:  //CALL TEST ;
  29:  ENDIF ;
  30:  FOR R[1]=1 TO 3 ;
  31:  $MCR.$GENOVERRIDE=R[1]*10 ;
  32:  ENDFOR ;
  33:  JMP LBL[1] ;
  34:  LBL[2] ;
/POS
P[1]{
   GP1:
	UF : 0, UT : 2,		CONFIG : 'N U T, 0, 0, 0',
	X =   600.000  mm,	Y =   -12.500  mm,	Z =   900.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =   -90.000 deg
   GP2:
	UF : 0, UT : 0,	
	J1=     6.378 deg
};
P[2:"above"]{
   GP1:
	UF : 0, UT : 2,	
	J1=     0.000 deg,	J2=   -40.966 deg,	J3=    43.328 deg,
	J4=     0.000 deg,	J5=   -84.792 deg,	J6=   180.000 deg
};
/END
