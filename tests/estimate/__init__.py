"""The solver against closed forms, numeric derivatives and an independent simulator."""
