! Chain of coupled van der Pol oscillators for AUTO-07p, as in crates/foldline-bench/src/own/chain.rs, with analytical
! derivatives.
!
! PAR(1) mu, PAR(2) coupling c, PAR(3) detuning delta; PAR(11) period. U = x_1, y_1, x_2, y_2, ...

      SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, IJAC, ICP(*)
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM,NDIM), DFDP(NDIM,*)
      DOUBLE PRECISION mu, c, delta, x, y, k
      INTEGER i, n

      mu = PAR(1); c = PAR(2); delta = PAR(3)
      n = NDIM/2
      DO i = 1, n
         x = U(2*i-1); y = U(2*i)
         F(2*i-1) = y
         F(2*i) = mu*(1d0 - x*x)*y - (1d0 + delta*i/n)*x
         IF (i > 1) F(2*i) = F(2*i) + c*(U(2*i-3) - x)
         IF (i < n) F(2*i) = F(2*i) + c*(U(2*i+1) - x)
      END DO
      IF (IJAC == 0) RETURN

      DFDU = 0d0
      DO i = 1, n
         x = U(2*i-1); y = U(2*i)
         DFDU(2*i-1,2*i) = 1d0
         k = 1d0 + delta*i/n
         IF (i > 1) THEN
            DFDU(2*i,2*i-3) = c
            k = k + c
         END IF
         IF (i < n) THEN
            DFDU(2*i,2*i+1) = c
            k = k + c
         END IF
         DFDU(2*i,2*i-1) = -2d0*mu*x*y - k
         DFDU(2*i,2*i) = mu*(1d0 - x*x)
      END DO
      IF (IJAC == 1) RETURN

      ! mu is the only parameter that varies.
      DO i = 1, n
         DFDP(2*i-1,1) = 0d0
         DFDP(2*i,1) = (1d0 - U(2*i-1)**2)*U(2*i)
      END DO
      END SUBROUTINE FUNC

      SUBROUTINE STPNT(NDIM,U,PAR,T)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(IN) :: T
      ! The profile comes from the file start.dat, the parameters from the constants file.
      END SUBROUTINE STPNT

      SUBROUTINE BCND
      END SUBROUTINE BCND

      SUBROUTINE ICND
      END SUBROUTINE ICND

      SUBROUTINE FOPT
      END SUBROUTINE FOPT

      SUBROUTINE PVLS
      END SUBROUTINE PVLS
