! Overhung rotor of models/overhung-rotor.toml for AUTO-07p, with analytical derivatives.
!
! PAR(1) Omega, PAR(2) kappa, PAR(3) zeta, PAR(4) epsilon, PAR(5) gamma, PAR(6) beta, PAR(7) K, PAR(8) J_p, PAR(9) m;
! PAR(11) period. U = u, v, u', v'.

      SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, IJAC, ICP(*)
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM,NDIM), DFDP(NDIM,*)
      DOUBLE PRECISION om, kap, zeta, eps, gam, bet, sharp, jp, m
      DOUBLE PRECISION r2, r, switch, contact, stiff, gyr, circ, slope

      om = PAR(1); kap = PAR(2); zeta = PAR(3); eps = PAR(4); gam = PAR(5)
      bet = PAR(6); sharp = PAR(7); jp = PAR(8); m = PAR(9)
      r2 = U(1)*U(1) + U(2)*U(2)
      r = SQRT(r2)
      contact = 0d0; slope = 0d0
      IF (kap /= 0d0 .AND. r > 0d0) THEN
         switch = TANH(sharp*(r - 1d0))
         contact = 0.5d0*(switch + 1d0)*bet*(1d0 - 1d0/r)
         ! d(contact)/dr, over r
         slope = (0.5d0*sharp*(1d0 - switch*switch)*bet*(1d0 - 1d0/r) + 0.5d0*(switch + 1d0)*bet/r2)/r
      END IF
      stiff = 1d0 - (1d0 - jp)*om*om + (1d0 - kap)*gam*r2 + kap*contact
      gyr = (2d0 - jp)*om
      circ = 2d0*zeta*om
      F(1) = U(3)
      F(2) = U(4)
      F(3) = m*eps*om*om + gyr*U(4) - 2d0*zeta*U(3) - stiff*U(1) + circ*U(2)
      F(4) = -gyr*U(3) - 2d0*zeta*U(4) - stiff*U(2) - circ*U(1)
      IF (IJAC == 0) RETURN

      ! d(stiff)/du = slope*u, d(stiff)/dv = slope*v
      slope = 2d0*(1d0 - kap)*gam + kap*slope
      DFDU = 0d0
      DFDU(1,3) = 1d0
      DFDU(2,4) = 1d0
      DFDU(3,1) = -stiff - slope*U(1)*U(1)
      DFDU(3,2) = circ - slope*U(1)*U(2)
      DFDU(3,3) = -2d0*zeta
      DFDU(3,4) = gyr
      DFDU(4,1) = -circ - slope*U(1)*U(2)
      DFDU(4,2) = -stiff - slope*U(2)*U(2)
      DFDU(4,3) = -gyr
      DFDU(4,4) = -2d0*zeta
      IF (IJAC == 1) RETURN

      ! Omega is the only parameter that varies.
      DFDP(1:2,1) = 0d0
      DFDP(3,1) = 2d0*m*eps*om + (2d0 - jp)*U(4) + 2d0*(1d0 - jp)*om*U(1) + 2d0*zeta*U(2)
      DFDP(4,1) = -(2d0 - jp)*U(3) + 2d0*(1d0 - jp)*om*U(2) - 2d0*zeta*U(1)
      END SUBROUTINE FUNC

      SUBROUTINE STPNT(NDIM,U,PAR,T)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(IN) :: T
      ! The profile comes from the file start.dat, Omega and kappa from the constants file.
      PAR(3:9) = (/ 0.01d0, 0.353d0, 0.25d0, 10d0, 150d0, 0.143d0, 0.9d0 /)
      END SUBROUTINE STPNT

      SUBROUTINE BCND
      END SUBROUTINE BCND

      SUBROUTINE ICND
      END SUBROUTINE ICND

      SUBROUTINE FOPT
      END SUBROUTINE FOPT

      SUBROUTINE PVLS(NDIM,U,PAR)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: PAR(*)
      END SUBROUTINE PVLS
