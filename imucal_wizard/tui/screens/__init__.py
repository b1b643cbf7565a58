"""The screens: the steps of the wizard, the bench, the dialogs."""
