"""How pyserial finds `vimc4://` addresses."""
